import json; from rast import *; from poses import *; from verify import forward,d,F,V
from PIL import Image, ImageDraw
S=json.load(open('sites.json')); rows=[]; bad=[]
for k,q in S.items():
    p=np.array(q['bary'])@V[F[q['triangle']]]; n=np.cross(*(V[F[q['triangle']]][1:]-V[F[q['triangle']]][0])); n/=np.linalg.norm(n)
    if np.linalg.norm(p-q['point_model'])>2e-5 or n@q['normal']<.8 or abs(sum(q['bary'])-1)>1e-5: bad.append((k,np.linalg.norm(p-q['point_model']),float(n@q['normal'])))
print('sites',len(S),'bad',bad)
v=forward(POSES['arms down'],np.zeros(10))[0]; c=(v.max(0)+v.min(0))/2; im=[]
for vw in('front','left','back'):
    a=Image.fromarray((rast(v,F,vw,440,820,450,c)*255).astype(np.uint8)); dr=ImageDraw.Draw(a); th=np.radians(VIEWS[vw][0]); R=np.array([[np.cos(th),0,np.sin(th)],[0,1,0],[-np.sin(th),0,np.cos(th)]]); N=vnorm(v,F)
    for k,q in S.items():
        p=(np.array(q['bary'])@v[F[q['triangle']]]-c)@R.T; n=(np.array(q['bary'])@N[F[q['triangle']]])@R.T
        if n[2]>.25 and not(vw=='left' and k.startswith('right')): x,y=220+p[0]*450,410-p[1]*450; dr.ellipse((x-3,y-3,x+3,y+3),fill=(200,0,0)); (dr.text((x+5,y-5),k.replace('left_','').replace('right_',''),fill=(0,0,120)) if not k.startswith('right') else None)
    im.append(np.asarray(a))
Image.fromarray(np.concatenate(im,1)).save('sites.png')
